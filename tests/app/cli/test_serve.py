"""``vsep serve`` from the command line."""

from collections.abc import Callable
from typing import Any

import pytest

FrameArrays = Callable[..., dict[str, Any]]
Refused = Callable[..., str]


@pytest.mark.parametrize("port", ["-1", "65536", "http"])
def test_serve_refuses_a_port_that_is_none(refused: Refused, port: str) -> None:
    assert "--port" in refused("serve", "--port", port)
