"""Changes to how Bokeh writes and reads changes of a document: not all of its models each time.

A picture is a message, and so is the word of a browser that it has drawn it. For each of them Bokeh
makes a table of all models of the page, two thousand or so, to look up a few: an eighth of the
server's time in front of a class. The document has that table already.

`CHANGES` are all of it: whose, its name, and what stands in its place. It gives what Bokeh gives;
`tests/app/test_message_facts.py` compares the two.
"""

from collections.abc import Iterator
from importlib import import_module
from typing import Any, Final

from bokeh.core.serialization import Deserializer, Serializer
from bokeh.document.models import DocumentModelManager
from bokeh.model import Model

_documents: Any = import_module("bokeh.document.document")
_patches: Any = import_module("bokeh.protocol.messages.patch_doc")


class _Known:
    """The models of a document that its browser knows; stands in for a set of them."""

    def __init__(self, models: Any) -> None:
        self.models = models

    def __iter__(self) -> Iterator[Any]:
        return (each for each in self.models if each not in self.models._new_models)

    def __contains__(self, model: Any) -> bool:
        held = self.models
        return held._models.get(model.id) is model and model not in held._new_models


class _DocumentSerializer(Serializer):
    """Writes what a browser knows by its reference, and looks it up when it comes."""

    def __init__(self, known: _Known) -> None:
        super().__init__()
        self._known = known

    def has_ref(self, obj: Any) -> bool:
        """Whether an object needs no more than its reference."""
        return super().has_ref(obj) or (isinstance(obj, Model) and obj in self._known)

    def get_ref(self, obj: Any) -> Any:
        """Return the reference of an object that needs no more."""
        written = super().get_ref(obj)
        if written is None and isinstance(obj, Model) and obj in self._known:
            return obj.ref
        return written


def _serializer(*, references: Any) -> Serializer:
    if isinstance(references, _Known):
        return _DocumentSerializer(references)
    return Serializer(references=references)


def _deserializer(references: Any = None, *, setter: Any = None) -> Deserializer:
    """Make what reads a message, with the table of its document."""
    made = Deserializer(setter=setter)
    if references:
        made._references = dict(references[0].document.models._models)
    return made


CHANGES: Final[tuple[tuple[Any, str, Any], ...]] = (
    (DocumentModelManager, "synced_references", property(_Known)),
    (_patches, "Serializer", _serializer),
    (_documents, "Deserializer", _deserializer),
)


def look_up_models() -> None:
    """Let messages look up the models they name."""
    for owner, name, ours in CHANGES:
        setattr(owner, name, ours)
