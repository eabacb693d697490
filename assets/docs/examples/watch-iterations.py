"""Watch a run, iteration by iteration.

Every step says what it did: bursts found, objects added, components pruned, and the evidence lower
bound. `vsep.run` takes a callable that is told every step; its own time does not count.
"""

import vsep
from vsep.inference.core.progress import EventKind, Step

scenario, observation = vsep.simulate_preset("simulation-2-b", snr_db=60.0, sir_db=-20.0, seed=7)
model = vsep.SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
separator = vsep.FactorisedSeparator(model=model)
steps: list[Step] = []


def show(step: Step) -> None:
    """Print one line an iteration."""
    steps.append(step)
    kinds = [event.kind for event in step.info.events]
    print(
        f"iteration {step.state.iteration:2d}: {kinds.count(EventKind.CHIRP_STARTED)} bursts and "
        f"{kinds.count(EventKind.OBJECT_ADDED)} objects added, ELBO {step.info.elbo:9.1f}"
    )


solution = vsep.run(separator, observation.received, watch=show)

assert len(steps) == solution.iterations
added = [e for s in steps for e in s.info.events if e.kind is EventKind.OBJECT_ADDED]
pruned = [e for s in steps for e in s.info.events if e.kind is EventKind.OBJECT_PRUNED]
assert len(added) - len(pruned) == solution.objects.num_components
assert steps[-1].info.elbo > steps[0].info.elbo
