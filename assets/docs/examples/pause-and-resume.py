"""Pause a run and resume it.

`vsep.iterate` gives one iteration at a time. Leaving the loop pauses the run; the state is all that
is needed to go on, in this process or, pickled, in another, and the result is equal to the last
bit.
"""

import pickle

import vsep

scenario, observation = vsep.simulate_preset("simulation-2-a", snr_db=60.0, sir_db=-20.0, seed=7)
model = vsep.SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
separator = vsep.FactorisedSeparator(model=model)

for step in vsep.iterate(separator, observation.received):
    if step.state.iteration == 3:
        break
stored = pickle.dumps(step.state)

resumed = vsep.run(separator, observation.received, state=pickle.loads(stored))
uninterrupted = vsep.run(separator, observation.received)

print(f"{resumed.state.iteration} iterations, {resumed.objects.num_components} objects")
assert resumed.state.iteration == uninterrupted.state.iteration
assert (resumed.objects.beats == uninterrupted.objects.beats).all()
