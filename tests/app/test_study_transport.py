from vsep_app.pages.studies.session import StudyPhase, StudySnapshot
from vsep_app.pages.studies.transport import StudyTransport, progress_text


def snapshot(num_rows, *, whole=100, phase=StudyPhase.RUNNING, failed=0, left_s=None):
    rows = ({"status": "done"},) * num_rows
    return StudySnapshot(phase=phase, rows=rows, num_rows=whole, num_failed=failed, left_s=left_s)


def test_progress_is_one_line():
    assert progress_text(snapshot(0)) == "0 of 100 rows"
    text = progress_text(snapshot(40, failed=2, left_s=30.0))
    assert text == "40 of 100 rows · 2 failed · 30 s left"


def test_buttons_offer_what_can_be_done():
    nothing = lambda *_: None  # noqa: E731
    transport = StudyTransport(run=nothing, halt=nothing, rows=nothing)
    for phase, run, halt in (
        (StudyPhase.STOPPED, True, False),
        (StudyPhase.RUNNING, False, True),
        (StudyPhase.STOPPING, False, False),
        (StudyPhase.FINISHED, True, False),
        (StudyPhase.BROKEN, True, False),
    ):
        busy = transport.show(snapshot(25, phase=phase))
        assert (not transport.run.disabled, not transport.halt.disabled) == (run, halt)
        assert busy is not run
        assert phase.value in transport.status.object
    assert transport.bar.value == 25


def test_the_figure_that_is_shown_stays_among_new_ones():
    nothing = lambda *_: None  # noqa: E731
    transport = StudyTransport(run=nothing, halt=nothing, rows=nothing)
    assert not transport.figure.visible
    transport.offer(["a", "b"])
    assert transport.figure.visible
    assert transport.figure.value == "a"
    transport.figure.value = "b"
    transport.offer(["a", "b", "c"])
    assert transport.figure.value == "b"
    transport.offer(["d"])
    assert transport.figure.value == "d"
