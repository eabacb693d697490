// Puts the map before, left of the line, and the map after, right of it, together.
const first = before.data.image[0]
const second = after.data.image[0]
if (first != null) {
  const [rows, columns] = first.shape
  const share = (line.location - before.data.x[0]) / before.data.dw[0]
  const whole = !line.visible || second == null || second.length !== first.length
  const cut = whole ? columns : Math.min(Math.max(Math.round(share * columns), 0), columns)
  const image = new first.constructor(first, [rows, columns])
  for (let row = 0; row < rows && cut < columns; row++) {
    const begin = row * columns + cut
    // Not `subarray`: of an array of Bokeh it is all of it.
    image.set(new Uint8Array(second.buffer, second.byteOffset + begin, columns - cut), begin)
  }
  const {x, y, dw, dh} = before.data
  shown.data = {image: [image], x, y, dw, dh}
}
