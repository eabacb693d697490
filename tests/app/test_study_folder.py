import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest
from vsep_app.pages.studies.folder import PageFolder


def test_a_folder_goes_after_the_last_who_writes_into_it():
    folder = PageFolder()
    begun, closed = threading.Event(), threading.Event()

    def writes():
        begun.set()
        assert closed.wait(5.0)
        (folder.path / "rows.jsonl").write_text("late")

    with ThreadPoolExecutor(max_workers=1) as pool:
        thread = threading.Thread(target=folder.write, args=(writes,))
        thread.start()
        assert begun.wait(5.0)
        job = folder.begin(partial(pool.submit, closed.wait, 5.0))
        folder.close()
        assert folder.path.exists()
        closed.set()
        thread.join()
        job.result()
    assert not folder.path.exists()


def test_a_closed_folder_takes_no_new_writer_and_is_closed_twice():
    folder = PageFolder()
    folder.close()
    folder.close()
    assert not folder.path.exists()
    with pytest.raises(FileNotFoundError, match="closed"):
        folder.write(lambda: None)


def test_a_job_that_is_refused_holds_no_folder():
    folder = PageFolder()
    pool = ThreadPoolExecutor(max_workers=1)
    pool.shutdown()
    with pytest.raises(RuntimeError):
        folder.begin(partial(pool.submit, print))
    folder.close()
    assert not folder.path.exists()
