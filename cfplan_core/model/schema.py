"""Faults against the JSON Schema of problem files, with what the schema wants in words."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from importlib import resources
from typing import Any

from cfplan_core.model.faults import Fault, Path, shown


@cache
def problem_schema() -> Mapping[str, Any]:
    """Return the JSON Schema (draft 2020-12) of ``cfplan/problem/1``."""
    file = resources.files('cfplan_core.model').joinpath('problem.schema.json')
    schema: Mapping[str, Any] = json.loads(file.read_text(encoding='utf-8'))
    return schema


def schema_faults(data: Mapping[str, Any]) -> Iterator[Fault]:
    """Check the form of a problem: keys, types, ranges of single values.

    Args:
        data: Plain data: dictionaries, lists, texts, numbers, truth values and None.
    """
    for error in _validator().iter_errors(data):
        translate = _TRANSLATIONS.get(error.validator, _mismatch)
        yield from translate(error, tuple(error.absolute_path))


def nearest(name: str, names: list[str]) -> str:
    """Say which of the valid names is meant, or else list them."""
    close = get_close_matches(name, names, n=1)
    return f'{close[0]!r}' if close else 'one of ' + ', '.join(names)


@cache
def _validator() -> Any:
    from jsonschema import Draft202012Validator, validators

    types = Draft202012Validator.TYPE_CHECKER.redefine('number', lambda _, v: _is_number(v))
    extend: Any = validators.extend
    return extend(Draft202012Validator, type_checker=types)(problem_schema())


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _mismatch(error: Any, path: Path) -> Iterator[Fault]:
    yield Fault(path, _value(error), _wanted(error.schema))


def _missing(error: Any, path: Path) -> Iterator[Fault]:
    # One error per missing key, which names it only in its message: all are reported with each.
    for key in error.validator_value:
        if key not in error.instance:
            yield Fault((*path, key), 'nothing', _wanted(error.schema['properties'][key]))


def _unknown(error: Any, path: Path) -> Iterator[Fault]:
    names = list(error.schema['properties'])
    for key, value in error.instance.items():
        if key not in names:
            yield Fault(
                (*path, key),
                f'{shown(value)} under an unknown key',
                f'{nearest(key, names)} as the key',
                usable=True,
            )


def _none_of(error: Any, path: Path) -> Iterator[Fault]:
    keys = [key for choice in error.validator_value for key in choice['required']]
    yield Fault(path, shown(error.instance), f'at least one of {", ".join(keys)}')


def _repeated(error: Any, path: Path) -> Iterator[Fault]:
    seen = set()
    for k, item in enumerate(map(repr, error.instance)):
        if item in seen:
            yield Fault((*path, k), f'{shown(error.instance[k])} again', 'each once')
        seen.add(item)


_TRANSLATIONS: Mapping[str, Any] = {
    'required': _missing,
    'additionalProperties': _unknown,
    'anyOf': _none_of,
    'uniqueItems': _repeated,
}


def _value(error: Any) -> str:
    """Write the value, with advice where a number was written as text."""
    value = error.instance
    text = shown(value)
    if isinstance(value, list) and error.validator in ('minItems', 'maxItems'):
        return f'{len(value)}: {text}'
    if error.validator != 'type' or error.validator_value != 'number':
        return text
    if not isinstance(value, str):
        return text
    try:
        number = float(value)
    except ValueError:
        return text
    return f'the text {text}' + (
        f' (written as a number: {_yaml_number(number)})' if math.isfinite(number) else ''
    )


def _yaml_number(number: float) -> str:
    """Write a number so that YAML 1.1 reads it as one: with a point before any exponent."""
    mantissa, exponent, power = repr(number).partition('e')
    return mantissa + ('' if '.' in mantissa else '.0') + exponent + power


def _wanted(schema: Mapping[str, Any]) -> str:
    """Say in words what a part of the schema asks for."""
    schema = _resolved(schema)
    if 'const' in schema:
        return repr(schema['const'])
    inline_or_path = 'if' in schema
    form = 'a mapping or a path' if inline_or_path else _FORMS[schema['type']](schema)
    return f'{form} ({schema["title"]})' if 'title' in schema else form


def _resolved(schema: Mapping[str, Any]) -> Mapping[str, Any]:
    if '$ref' not in schema:
        return schema
    name = schema['$ref'].removeprefix('#/$defs/')
    definition: Mapping[str, Any] = problem_schema()['$defs'][name]
    return definition


def _number_form(schema: Mapping[str, Any]) -> str:
    bounds = [
        f'{words} {schema[key]}'
        for key, words in (
            ('exclusiveMinimum', 'greater than'),
            ('minimum', 'at least'),
            ('maximum', 'at most'),
        )
        if key in schema
    ]
    return 'a finite number' + (' ' + ' and '.join(bounds) if bounds else '')


def _list_form(schema: Mapping[str, Any]) -> str:
    least, most = schema.get('minItems'), schema.get('maxItems')
    items = 'numbers' if _resolved(schema['items'])['type'] == 'number' else 'items'
    if least is not None and least == most:
        return f'a list of {least} {items}'
    if most is not None:
        return f'a list of {least} to {most} {items}'
    return 'a list' + (f' of at least {least}' if least else '')


_FORMS: Mapping[str, Any] = {
    'number': _number_form,
    'array': _list_form,
    'object': lambda schema: 'a mapping' + (', not empty' if 'minProperties' in schema else ''),
    'string': lambda schema: 'a text',
    'boolean': lambda schema: 'true or false',
}
