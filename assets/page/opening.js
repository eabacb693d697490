// What this program alters of BokehJS, before the page is mounted; see `vsep_app.server.opening`.
(() => {
  // A style sheet that would only be the same again is left alone: a figure that is drawn anew
  // writes those of all its parts, whereupon the browser computes the styles of the page.
  const sheet = Bokeh.require("core/dom").InlineStyleSheet.prototype
  const write = sheet._update
  sheet._update = function (css) { if (this.el.textContent !== css) write.call(this, css) }
  // Every component that is mounted, and every title that changes, asks for the layout of all
  // figures. They are laid out once for all that asked since the last frame of the screen.
  const {LayoutDOMView} = Bokeh.require("models/layouts/layout_dom")
  const view = LayoutDOMView.prototype
  const {invalidate_layout, compute_layout} = view
  const later = (root, name, layout) => {
    if (!root._layout_computed || root.vsep_at_work) return layout.call(root)
    const waiting = root.vsep_waiting ??= new Map()
    if (waiting.size === 0) {
      const go = () => {
        if (waiting.size === 0) return
        // The one with styles does all that the other does.
        const [all, some] = [waiting.get("invalidate"), waiting.get("compute")]
        waiting.clear()
        root.vsep_at_work = true
        try { if (!root.is_destroyed) (all ?? some).call(root) } finally { root.vsep_at_work = false }
      }
      // No frame comes where nobody sees the page.
      requestAnimationFrame(go)
      setTimeout(go, 100)
    }
    waiting.set(name, layout)
  }
  view.invalidate_layout = function () {
    if (this.parent instanceof LayoutDOMView) this.parent.invalidate_layout()
    else later(this, "invalidate", invalidate_layout)
  }
  view.compute_layout = function () {
    if (this.parent instanceof LayoutDOMView) return compute_layout.call(this)
    later(this, "compute", compute_layout)
  }
})()
