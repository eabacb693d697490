"""One tab of a headless browser that tests use one after the other, and the served dashboard."""

import pytest

from tests.app.browser.tab import CHROMIUM, LAUNCH, SCREEN, SIMULATION_1, Dashboard, Tab

_FAILED = pytest.StashKey[bool]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item):
    """Let fixtures know that their test has failed."""
    report = yield
    item.stash[_FAILED] = item.stash.get(_FAILED, False) or report.failed
    return report


@pytest.fixture(scope="session")
def browser_type_launch_args(browser_type_launch_args):
    """Use the system's browser."""
    if CHROMIUM is None:
        pytest.skip("no chromium found on the PATH")
    return {**browser_type_launch_args, "executable_path": CHROMIUM, "args": LAUNCH}


@pytest.fixture(scope="session")
def app_url(app_server):
    return f"http://127.0.0.1:{app_server.port}/"


@pytest.fixture(scope="session")
def shared_tab(browser):
    """The tab; what costs most of a test is to open a page, so that pages stay open in it."""
    tab = Tab(browser)
    yield tab
    tab.close()


@pytest.fixture
def tab(shared_tab, caplog, request):
    """The tab, for a test that fails on any outside request, console error or server error."""
    shared_tab.resize(SCREEN)
    yield shared_tab
    shared_tab.close_other_pages()
    if request.node.stash.get(_FAILED, False):
        # Nobody knows what a test that was left in its middle has done to the page.
        shared_tab.close()
    server = [r.getMessage() for r in caplog.records if r.levelname in ("ERROR", "CRITICAL")]
    assert (*shared_tab.take_faults(), server) == ([], [], [])


@pytest.fixture
def dashboard(tab, app_server):
    """The live view, with whatever the test before it has left there."""
    return Dashboard(tab, app_server)


@pytest.fixture
def at_rest(dashboard):
    """The live view of Simulation I, run to its end."""
    if dashboard.rests_at(SIMULATION_1):
        return dashboard
    return dashboard.show(SIMULATION_1).until_status("converged")
