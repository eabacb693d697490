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
    const varied = [...document.querySelectorAll("input.varied")]
    let run = null, items = []

    // The run that the sliders of the varied settings choose, of which the last varies fastest.
    const choose = () => {
      let number = 0
      varied.forEach((each, n) => {
        const {values} = replay.varied[n]
        number = number * values.length + Number(each.value)
        each.nextElementSibling.textContent = values[Number(each.value)]
      })
      const ended = run === null || slider.value === slider.max
      run = replay.runs[number]
      for (const version of run.axes) apply(models, version)
      slider.max = run.iterations.length - 1
      if (ended) slider.value = slider.max
      by("levels").textContent = run.levels
      by("events").innerHTML = replay.tables[run.events]
      items = [...document.querySelectorAll("ol.log li")]
      ramp?.replaceChildren(...run.ramps.map((number, n) => new Option(number, n, false, n === run.ramp)))
      document.body.dataset.run = number
    }

    const show = () => {
      const iteration = run.numbers[Number(slider.value)]
      const shown = run.iterations[Number(slider.value)]
      const chosen = ramp === null ? run.ramp : Number(ramp.value)
      for (const version of shown.versions[chosen]) apply(models, version)
      by("table").innerHTML = replay.tables[shown.table]
      by("status").textContent = shown.status
      items.forEach((item, n) => { item.hidden = run.log[n] > iteration })
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
    for (const each of varied) {
      each.addEventListener("input", () => { pause(); choose(); show() })
    }
    choose()
    show()
  }

  const wait = () => {
    const bokeh = window.Bokeh && window.Bokeh.documents[0]
    if (bokeh && bokeh.roots().length) start(bokeh)
    else setTimeout(wait, 20)
  }
  wait()
})()

// Says of a number whether it is right, as near as asked for.
for (const field of document.querySelectorAll("input[data-truth]")) {
  field.addEventListener("change", () => {
    const off = Math.abs(Number(field.value.replace(",", ".")) - Number(field.dataset.truth))
    const right = off <= Number(field.dataset.tolerance)
    document.getElementById("verdict").textContent = right ? "Right." : "Not so: look again."
  })
}

// Says of a prediction whether it came, once one is chosen.
for (const choice of document.querySelectorAll("input[name=predict]")) {
  choice.addEventListener("change", () => {
    const right = choice.dataset.right === "true"
    document.getElementById("verdict").textContent = right ? "Right: so it ends." : "Not so: watch the run."
  })
}
