// Hands a drag in a figure to the program: its begin, its end, and between them 20 times a second.
const EVERY_MS = 50
const PHASES = {panstart: 0, pan: 1, panend: 2}
const phase = PHASES[cb_obj.event_name]
const now = performance.now()
const last = dragged.last_told ?? 0
if (phase !== 1 || now - last >= EVERY_MS) {
  dragged.last_told = now
  const frame = Bokeh.index.find_one_by_id(plot.id).frame
  const size = (range, pixels) => Math.abs(range.end - range.start) / Math.max(pixels, 1)
  dragged.data = {
    phase: [phase], x: [cb_obj.x], y: [cb_obj.y],
    dx: [size(plot.x_range, frame.bbox.width)], dy: [size(plot.y_range, frame.bbox.height)],
    number: [dragged.data.number[0] + 1],
  }
}
