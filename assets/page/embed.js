// Speaks with the page around a frame. Runs with every picture; the first one begins to listen.
// Only pages that the server names in `frame-ancestors` can stand around this one, and only the
// one directly around it is listened to.
const say = (kind, content) => {
  if (window.parent !== window) window.parent.postMessage({source: "vsep", kind, ...content}, "*")
}
const models = () => [...Bokeh.documents[0].all_models]
const place = () => models().find((model) => model.type === "panel.models.location.Location")
const settings = () => {
  const {iteration: _, ...others} = Object.fromEntries(new URLSearchParams(place()?.search ?? ""))
  return others
}

function press(name) {
  pressed.data = {name: [name], number: [pressed.data.number[0] + 1]}
}

function listen(event) {
  const asked = event.data
  if (event.source !== window.parent || asked?.target !== "vsep") return
  if (asked.settings && place()) {
    const query = new URLSearchParams(place().search)
    for (const [name, value] of Object.entries(asked.settings)) query.set(name, String(value))
    place().search = `?${query}`
  }
  const iteration = asked.iteration
  if (Number.isInteger(iteration) && iteration >= 0 && iteration < 1e6) press(`iteration ${iteration}`)
  if (asked.play === true && !window.vsep_plays) press("toggle")
  if (asked.play === false && window.vsep_plays) press("toggle")
}

if (!window.vsep_embedded) {
  window.vsep_embedded = true
  window.addEventListener("message", listen)
  say("ready", {settings: settings()})
}
function tell() {
  const state = JSON.parse(told.data.state[0])
  if (state.iteration === undefined) return
  if (window.vsep_told !== told.data.state[0]) {
    window.vsep_told = told.data.state[0]
    window.vsep_plays = state.plays
    say("iteration", state)
  }
  const now = JSON.stringify(settings())
  if (window.vsep_settings !== now) {
    window.vsep_settings = now
    say("settings", {settings: settings()})
  }
}

// When all that a picture brings has arrived.
setTimeout(tell, 0)
