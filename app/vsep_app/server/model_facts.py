"""Changes to Bokeh's models: what each model works out anew is worked out once a class.

A page is some hundreds of models with some dozens of properties each, most of which keep their
defaults. Bokeh copies and checks a default whenever it is asked for, looks through all properties
of a model for those whose defaults are made anew, makes lists and mappings that nobody fills, and
asks for all defaults again to write a model and to find what it refers to. Together that was
nearly half of the server's time for an opening, and a third of the memory of a page.

`CHANGES` are all of it: whose, its name, and what stands in its place. It gives what Bokeh gives;
`tests/app/test_model_facts.py` compares the two.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, Final

import bokeh.model.util as model_util
from bokeh.core.has_props import HasProps
from bokeh.core.property.descriptors import PropertyDescriptor
from bokeh.core.property.singletons import Intrinsic, Undefined
from bokeh.core.property.wrappers import PropertyValueContainer
from bokeh.model import Model

_THEMED: Final = "__themed_values__"
# Values that nobody can change: all models of a class may have the same one.
_UNCHANGING: Final = frozenset({str, int, float, bool, type(None), type(Undefined)})

_get_default = PropertyDescriptor._get_default
_has_unstable_default = PropertyDescriptor.has_unstable_default
_query = HasProps.query_properties_with_values
_visit_within = model_util.visit_immediate_value_references
_visit = model_util.visit_value_and_its_immediate_references
_overridden_defaults: Any = HasProps.__dict__["_overridden_defaults"].__func__
_constants: dict[type[Any], dict[str, Any]] = {}


def _of_class(descriptor: Any, model_class: Any) -> bool:
    return bool(_has_unstable_default(descriptor, model_class))


_is_unstable = cache(_of_class)
_overridden: Any = cache(_overridden_defaults)


@cache
def _own(model_class: Any) -> tuple[Any, ...]:
    """Return the properties of a class without those that are other names of another one."""
    names = model_class.properties(_with_props=True)
    descriptors = (model_class.lookup(name) for name in names)
    return tuple(each for each in descriptors if isinstance(each, PropertyDescriptor))


@cache
def _made_with(model_class: Any) -> tuple[Any, ...]:
    """Return the properties whose defaults a new model needs at once: other models.

    What is an empty list or mapping by default is made when somebody asks for it.
    """
    return tuple(
        each
        for each in _own(model_class)
        if _is_unstable(each, model_class) and not _is_empty(each.class_default(model_class))
    )


def _is_empty(default: Any) -> bool:
    return isinstance(default, PropertyValueContainer) and not default


@cache
def _required(model_class: Any) -> frozenset[str]:
    """Return the properties that have no default: one that is not set is an error."""
    return frozenset(
        each.name for each in _own(model_class) if each.class_default(model_class) is Undefined
    )


def _make(self: Any, **properties: Any) -> None:
    """Make a model; stands in for `HasProps.__init__`."""
    super(HasProps, self).__init__()
    self._property_values = {}
    self._unstable_default_values = {}
    self._unstable_themed_values = {}
    for name, value in properties.items():
        if value is not Undefined and value is not Intrinsic:
            setattr(self, name, value)
    for descriptor in _made_with(self.__class__):
        if descriptor.name not in properties:
            descriptor._get(self)
    self._initialized = True


def _themed_values(self: Any) -> Any:
    """Return the values of a theme; `getattr` asks a slow `__getattr__` where there is none."""
    return self.__dict__.get(_THEMED)


def _get(self: Any, model: Any) -> Any:
    """Return the value of a property; of a default that cannot change that of the class."""
    name, held = self.name, model._property_values
    if name in held:
        return held[name]
    if _THEMED in model.__dict__:
        return _get_default(self, model)
    made = model._unstable_default_values
    if name in made:
        return made[name]
    constants = _constants.setdefault(model.__class__, {})
    if name not in constants:
        value = _get_default(self, model)
        if type(value) not in _UNCHANGING or self.has_unstable_default(model):
            return value
        constants[name] = value
    return constants[name]


def _written(
    self: Any,
    query: Callable[[Any], bool],
    *,
    include_defaults: bool = True,
    include_undefined: bool = False,
) -> Any:
    """Return the properties of a model that differ from their defaults, or all."""
    if include_defaults or include_undefined or _THEMED in self.__dict__:
        return _query(
            self, query, include_defaults=include_defaults, include_undefined=include_undefined
        )
    held, made, required = (
        self._property_values,
        self._unstable_default_values,
        _required(self.__class__),
    )
    result = {}
    for descriptor in _own(self.__class__):
        name = descriptor.name
        if (name in held or name in made or name in required) and query(descriptor):
            value = descriptor.get_value(self)
            if name in held or not isinstance(value, PropertyValueContainer):
                result[name] = value
    return result


def _visit_model(value: Any, visitor: Callable[[Model], None]) -> None:
    """Visit what a model refers to: defaults that are made for no model are none."""
    if not isinstance(value, HasProps) or _THEMED in value.__dict__:
        _visit_within(value, visitor)
        return
    held, made = value._property_values, value._unstable_default_values
    for name in value.properties_with_refs():
        child = held[name] if name in held else made.get(name)
        if type(child) not in _UNCHANGING:
            _visit(child, visitor)


def _unstable_of_class(self: Any, model: Any) -> bool:
    return _is_unstable(self, model.__class__)


CHANGES: Final[tuple[tuple[Any, str, Any], ...]] = (
    (HasProps, "__init__", _make),
    (HasProps, "themed_values", _themed_values),
    (HasProps, "query_properties_with_values", _written),
    (HasProps, "_overridden_defaults", classmethod(_overridden)),
    (PropertyDescriptor, "_get", _get),
    (PropertyDescriptor, "has_unstable_default", _unstable_of_class),
    (model_util, "visit_immediate_value_references", _visit_model),
)


def remember_defaults() -> None:
    """Let models ask once a class, not once a model, for what is the same for all of it."""
    for owner, name, ours in CHANGES:
        setattr(owner, name, ours)
