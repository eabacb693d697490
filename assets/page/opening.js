// What this program alters of BokehJS, before the page is mounted; see `vsep_app.server.opening`.
(() => {
  // Modules of components are imported by the browser itself. What Panel brings for browsers that
  // cannot do so reads the whole module first, and has a copy of it imported, which no browser keeps.
  const load = (url) => import(new URL(url, document.baseURI).href)
  window.importShim = Object.assign(load, {addImportMap() {}})
  // Panel adds an entry to the browser's history with every change of the address; one a tab is
  // enough, and leads back to it.
  const push = history.pushState.bind(history)
  history.pushState = (state, unused, url) => {
    const is_here = new URL(url, location.href).pathname === location.pathname
    if (is_here) history.replaceState(state, unused, url)
    else push(state, unused, url)
  }
  // The looks of figures are set by their models alone, not by variables of style sheets, which would
  // be looked up with every part of a figure that is laid out or drawn.
  Bokeh.require("core/visuals/visual").VisualProperties.prototype._get_css_value = () => ""
  // A style sheet that would only be the same again is left alone: a figure that is drawn anew
  // writes those of all its parts, whereupon the browser computes the styles of the page.
  const sheet = Bokeh.require("core/dom").InlineStyleSheet.prototype
  const write = sheet._update
  sheet._update = function (css) { if (this.el.textContent !== css) write.call(this, css) }
  // Every component that is mounted, and every title that changes, asks for the layout of all
  // figures. They are laid out once for all that asked since the last frame of the screen; while
  // components are being mounted, once for all that asked before it is quiet for a while.
  const QUIET_MS = 100, LONGEST_MS = 1000
  const {LayoutDOMView} = Bokeh.require("models/layouts/layout_dom")
  const later = (root, name, layout) => {
    if (!root._layout_computed || root.vsep_at_work) return layout.call(root)
    const waiting = root.vsep_waiting ??= new Map()
    const go = () => {
      if (waiting.size === 0) return
      // The one with styles does all that the other does.
      const [all, some] = [waiting.get("invalidate"), waiting.get("compute")]
      waiting.clear()
      clearTimeout(root.vsep_quiet)
      root.vsep_at_work = true
      try { if (!root.is_destroyed) (all ?? some).call(root) } finally { root.vsep_at_work = false }
    }
    const is_first = waiting.size === 0
    waiting.set(name, layout)
    if (!root.model.document?.is_idle) {
      clearTimeout(root.vsep_quiet)
      root.vsep_quiet = setTimeout(go, QUIET_MS)
      if (is_first) setTimeout(go, LONGEST_MS)
    } else if (is_first) {
      // No frame comes where nobody sees the page.
      requestAnimationFrame(go)
      setTimeout(go, 100)
    }
  }
  const at_the_root = (prototype, is_root) => {
    const {invalidate_layout, compute_layout} = prototype
    prototype.invalidate_layout = function () {
      if (is_root(this)) later(this, "invalidate", invalidate_layout)
      else invalidate_layout.call(this)
    }
    prototype.compute_layout = function () {
      if (is_root(this)) later(this, "compute", compute_layout)
      else compute_layout.call(this)
    }
  }
  at_the_root(LayoutDOMView.prototype, (view) => !(view.parent instanceof LayoutDOMView))
  // The whole page is such a component, and lays out itself.
  let component = Bokeh.Models.get("panel.models.esm.ReactComponent").prototype.default_view.prototype
  while (!Object.hasOwn(component, "compute_layout")) component = Object.getPrototypeOf(component)
  at_the_root(component, (view) => !view.is_managed)
  // What is hidden needs no layout; it gets one when it is shown. But until all is mounted Bokeh
  // takes what was never laid out for unfinished.
  const parts = Object.getOwnPropertyDescriptor(LayoutDOMView.prototype, "layoutable_views").get
  Object.defineProperty(LayoutDOMView.prototype, "layoutable_views", {
    get() {
      return this.model.visible || !this.model.document?.is_idle ? parts.call(this) : []
    },
  })
  // Of what is shown or hidden every part notes where all below it are, though that follows with the
  // next layout.
  LayoutDOMView.prototype.after_resize = function () {
    this._resized = true
    if (this._update_bbox()) this._after_resize()
    this.finish()
  }
})()
