"""``vsep serve`` from the command line."""

from collections.abc import Callable
from typing import Any

import pytest
from vsep_app.cli.main import main

FrameArrays = Callable[..., dict[str, Any]]
Refused = Callable[..., str]


@pytest.mark.parametrize("port", ["-1", "65536", "http"])
def test_serve_refuses_a_port_that_is_none(refused: Refused, port: str) -> None:
    assert "--port" in refused("serve", "--port", port)


@pytest.mark.parametrize("prefix", ["a b", "../x", "http://x", "a//b", "?x"])
def test_serve_refuses_a_folder_that_is_none(refused: Refused, prefix: str) -> None:
    assert "--prefix" in refused("serve", "--prefix", prefix)


@pytest.mark.parametrize(
    ("option", "value"),
    [("--allow-websocket-origin", "*"), ("--frame-ancestor", "lms.example.org")],
)
def test_serve_refuses_names_that_are_none(
    refused: Refused, monkeypatch: pytest.MonkeyPatch, option: str, value: str
) -> None:
    monkeypatch.setattr("vsep_app.cli.serve.separate_one_frame", lambda: None)
    assert value in refused("serve", option, value)


def test_who_gets_in_is_what_the_options_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the address is that of the room only with `--classroom`."""
    told: dict[str, Any] = {}
    monkeypatch.setattr("vsep_app.cli.serve.separate_one_frame", lambda: None)
    monkeypatch.setattr("vsep_app.server.main.serve", lambda **options: told.update(options))
    monkeypatch.setenv("VSEP_TOKEN", "a-token-of-the-test")
    options = ["--classroom", "--no-token", "--prefix", "a/b", "--allow-websocket-origin", "x:1"]
    main(["serve", *options, "--allow-websocket-origin", "y"])
    entry = told["entry"]
    assert (told["address"], told["prefix"]) == ("0.0.0.0", "a/b")
    assert (entry.token, entry.with_code, entry.open_to_all) == ("a-token-of-the-test", True, True)
    assert entry.origins == ["x:1", "y"]
    monkeypatch.delenv("VSEP_TOKEN")
    main(["serve"])
    entry = told["entry"]
    assert (told["address"], entry.token) == ("127.0.0.1", None)
    assert (entry.with_code, entry.open_to_all) == (False, False)
