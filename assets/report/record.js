// Plays a recorded run: hands the sources of the figures what they held in each iteration.
(() => {
  const replay = JSON.parse(document.getElementById("vsep-replay").textContent)
  const by = (id) => document.getElementById(id)
  const decoded = new Map()
  const current = new Map()
  const UNDEFINED = -1024
  const PERIOD_MS = 400
  let timer = null

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))

  const decode = (number) => {
    if (decoded.has(number)) return decoded.get(number)
    const value = replay.values[number]
    let column = value.data
    if (value.kind === "short") column = new Float32Array(bytes(value.data).buffer)
    if (value.kind === "map") column = bytes(value.data)
    if (value.kind === "curve") {
      let code = 0
      column = Float32Array.from(value.data, (difference) => {
        code += difference
        return code === UNDEFINED ? NaN : value.lowest + code * value.step
      })
    }
    decoded.set(number, column)
    return column
  }

  const apply = (models, version) => {
    const [player, kind, content] = replay.versions[version]
    if (current.get(player) === version) return
    current.set(player, version)
    const model = models[player]
    if (kind === "set") {
      for (const [name, value] of Object.entries(content)) model[name] = value
      return
    }
    const data = {}
    for (const [name, number] of Object.entries(content)) {
      const column = decode(number)
      if (replay.values[number].kind === "map") {
        const image = model.data[name][0]
        image.set(column)
        data[name] = [image]
      } else {
        data[name] = column
      }
    }
    model.data = data
  }

  const start = (bokeh) => {
    const models = replay.players.map((id) => bokeh.get_model_by_id(id))
    const slider = by("iteration"), play = by("play"), ramp = by("ramp")
    const items = [...document.querySelectorAll("ol.log li")]

    const show = () => {
      const iteration = Number(slider.value)
      const shown = replay.iterations[iteration]
      const chosen = ramp === null ? replay.ramp : Number(ramp.value)
      for (const version of shown.versions[chosen]) apply(models, version)
      by("table").innerHTML = replay.tables[shown.table]
      by("status").textContent = shown.status
      items.forEach((item, n) => { item.hidden = replay.log[n] > iteration })
      document.body.dataset.iteration = iteration
    }

    const pause = () => {
      clearInterval(timer)
      timer = null
      play.textContent = "Play"
    }

    play.addEventListener("click", () => {
      if (timer !== null) return pause()
      if (slider.value === slider.max) slider.value = 0
      play.textContent = "Pause"
      show()
      timer = setInterval(() => {
        slider.value = Number(slider.value) + 1
        show()
        if (slider.value === slider.max) pause()
      }, PERIOD_MS)
    })
    slider.addEventListener("input", () => { pause(); show() })
    if (ramp !== null) ramp.addEventListener("change", show)
    show()
  }

  const wait = () => {
    const bokeh = window.Bokeh && window.Bokeh.documents[0]
    if (bokeh && bokeh.roots().length) start(bokeh)
    else setTimeout(wait, 20)
  }
  wait()
})()

// Says of a prediction whether it came, once one is chosen.
for (const choice of document.querySelectorAll("input[name=predict]")) {
  choice.addEventListener("change", () => {
    const right = choice.dataset.right === "true"
    document.getElementById("verdict").textContent = right ? "Right: so it ends." : "Not so: watch the run."
  })
}
