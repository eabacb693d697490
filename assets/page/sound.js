// Plays what has come, in place of what is still playing. Nothing is heard before a click.
const [samples] = sound.data.samples
window.vsep_sound?.stop()
window.vsep_sound = null
if (samples) {
  window.vsep_audio ??= new AudioContext()
  const buffer = window.vsep_audio.createBuffer(1, samples.length, rate_hz)
  buffer.copyToChannel(Float32Array.from(samples), 0)
  const player = window.vsep_audio.createBufferSource()
  player.buffer = buffer
  player.connect(window.vsep_audio.destination)
  player.onended = () => { if (window.vsep_sound === player) window.vsep_sound = null }
  window.vsep_audio.resume()
  player.start()  // begun at once, so that a second click may stop it
  window.vsep_sound = player
  window.vsep_heard = (window.vsep_heard ?? 0) + samples.length / rate_hz
}
