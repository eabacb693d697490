"""The pages and a recorded run in Firefox."""

import pytest
from vsep_app.cli.main import main
from vsep_app.pages import PAGES

from tests.app.browser.firefox import FIREFOX, Firefox

# `test_every_page` and `test_report` ask the same of Chromium in `make test`.
pytestmark = [
    pytest.mark.ui,
    pytest.mark.slow,
    pytest.mark.skipif(FIREFOX is None, reason="no firefox found on the PATH"),
]
STATUS = "find('[role=status]').map((each) => each.innerText)[0]"


@pytest.fixture(scope="module")
def firefox(tmp_path_factory):
    browser = Firefox(tmp_path_factory.mktemp("firefox"))
    yield browser
    browser.close()


def test_a_run_is_seen_to_its_end(firefox, app_server):
    url = f"http://127.0.0.1:{app_server.port}/"
    firefox.open(f"{url}?preset=simulation-1&speed=30")
    firefox.until("find('canvas').length > 0")
    firefox.until(f"{STATUS} === 'converged'")
    assert firefox.evaluate("find('table.components tr.found').length") == 1
    assert firefox.errors == []
    assert all(each.startswith((url, "data:", "blob:")) for each in firefox.requests)


@pytest.mark.parametrize("address", [each for each in PAGES if each != "./"])
def test_every_page_opens_without_a_fault(firefox, app_server, address):
    firefox.errors.clear()
    firefox.open(f"http://127.0.0.1:{app_server.port}/{address.removeprefix('./')}")
    firefox.until("find('canvas').length > 0")
    assert firefox.errors == []


def test_a_recorded_run_plays_from_disk_without_a_request(firefox, tmp_path):
    out = tmp_path / "run.html"
    assert main(["report", "--preset", "simulation-2-b", "--record", str(out)]) == 0
    firefox.requests.clear()
    firefox.errors.clear()
    firefox.open(out.as_uri())
    firefox.until("find('canvas').length > 0")
    firefox.until("'iteration' in document.body.dataset")
    assert firefox.evaluate("find('table.components tr.found').length") == 10
    firefox.evaluate("find('input[type=range]')[0].focus()")
    firefox.evaluate("find('button').find((each) => /Play/.test(each.innerText)).click()")
    firefox.until("Number(document.body.dataset.iteration) >= 2")
    assert firefox.errors == []
    assert {each for each in firefox.requests if not each.startswith(("data:", "blob:"))} == {
        out.as_uri()
    }
