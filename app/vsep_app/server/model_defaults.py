"""Cached defaults of Bokeh's models.

Every property of every model asks which defaults its class overrides, and whether its own must be
made anew for each model. Both follow from the class alone, and a page has hundreds of models of
some forty classes.
"""

from functools import cache
from typing import Any

from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor

# As Bokeh has them: of a class, and of a property and a class.
_models: Any = HasProps
overridden_defaults = _models._overridden_defaults.__func__
has_unstable_default = PropertyDescriptor.has_unstable_default

_overridden_defaults_once: Any = cache(overridden_defaults)
_has_unstable_default_once = cache(has_unstable_default)


def remember_defaults() -> None:
    """Let all models made from now on ask once a class."""
    _models._overridden_defaults = classmethod(_overridden_defaults_once)
    PropertyDescriptor.has_unstable_default = _of_its_class


def _of_its_class(descriptor: Any, model: Any) -> bool:
    """Whether the default of a property is made anew for every model."""
    return bool(_has_unstable_default_once(descriptor, model.__class__))
