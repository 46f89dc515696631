"""YAML to plain data: what a safe loader drops or trips over becomes a fault."""

from __future__ import annotations

import re
from pathlib import Path as FilePath
from typing import Any

from cfplan_core.model.faults import Fault, Path, shown, within_double

LARGEST_FILE = 16 * 2**20
"""Bytes."""

LARGEST_DOCUMENT = 1_000_000
"""Values, where every alias counts as what it stands for."""

DEEPEST_NESTING = 100

_MAP = 'tag:yaml.org,2002:map'
_SEQUENCE = 'tag:yaml.org,2002:seq'
_TEXT = 'tag:yaml.org,2002:str'
_MERGE = 'tag:yaml.org,2002:merge'
_PLAIN = {f'tag:yaml.org,2002:{kind}' for kind in ('str', 'int', 'float', 'bool', 'null')}

# YAML 1.1 reads 1:30 as 90 and 010 as 8; other readers, and people, do not.
_SURPRISING_NUMBER = re.compile(r'[-+]?0[0-9_]+|.*:.*')


class _Unreadable(Exception):
    """Carries the fault that ends the reading of a file."""

    def __init__(self, fault: Fault) -> None:
        self.fault = fault
        super().__init__(str(fault))


def read_yaml(path: FilePath, contents: str, named_in: str = '') -> tuple[object, list[Fault]]:
    """Read a YAML 1.1 file of one document.

    Keys are taken as the text that they are written as, dates as text.

    Args:
        path: The file.
        contents: What it should hold, for the faults.
        named_in: The file that refers to it, for the faults; empty if none does.

    Returns:
        Dictionaries, lists, texts, numbers, truth values and None (None also if the file cannot
        be read), and what is wrong.
    """
    try:
        return _Converter().document(_text(path, contents, named_in))
    except _Unreadable as stop:
        return None, [stop.fault]


def _text(path: FilePath, contents: str, named_in: str) -> bytes:
    origin = f', named in {named_in}' if named_in else ''
    try:
        with path.open('rb') as stream:
            text = stream.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or str(error)
        raise _Unreadable(Fault((), f'{reason[:1].lower()}{reason[1:]}{origin}', '')) from None
    if len(text) > LARGEST_FILE:
        expected = f'{contents}{origin}, in at most {LARGEST_FILE} bytes'
        raise _Unreadable(Fault((), 'a larger file', expected))
    return text


class _Converter:
    """Turns the nodes of one document into plain data and gathers faults on the way."""

    def __init__(self) -> None:
        self._faults: list[Fault] = []
        self._done: dict[int, tuple[Any, int, int]] = {}
        self._open: set[int] = set()

    def document(self, text: bytes) -> tuple[object, list[Fault]]:
        import yaml

        loader_class = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
        try:
            self._limit_nesting(yaml.parse(text, Loader=loader_class))
            self._loader = loader_class(text)
            try:
                node = self._loader.get_single_node()
                data = None if node is None else self._value(node, ())[0]
            finally:
                self._loader.dispose()
        except yaml.YAMLError as error:
            raise _Unreadable(_syntax_fault(error)) from None
        return data, self._faults

    def _limit_nesting(self, events: Any) -> None:
        # Composing recurses, in C: a file of brackets alone would end the process.
        import yaml

        depth = 0
        for event in events:
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > DEEPEST_NESTING:
                    raise _Unreadable(_too_deep(event.start_mark))
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1

    def _value(self, node: Any, path: Path) -> tuple[Any, int, int]:
        """Return a node's data, the number of values in it and its depth."""
        key = id(node)
        if key in self._open:
            raise _Unreadable(
                Fault(
                    (_place(node.start_mark),),
                    'an alias inside its own anchor',
                    'values that do not hold themselves',
                )
            )
        if key not in self._done:
            self._open.add(key)
            if node.id == 'scalar':
                self._done[key] = self._scalar(node, path), 1, 0
            elif node.tag not in (_MAP, _SEQUENCE):
                self._done[key] = self._untagged(node, path), 1, 0
            elif node.id == 'sequence':
                self._done[key] = self._sequence(node, path)
            else:
                self._done[key] = self._mapping(node, path)
            self._open.discard(key)
        value, size, depth = self._done[key]
        if size > LARGEST_DOCUMENT:
            raise _Unreadable(
                Fault((), 'more values', f'at most {LARGEST_DOCUMENT} values, aliases expanded')
            )
        if depth > DEEPEST_NESTING:
            raise _Unreadable(_too_deep(node.start_mark))
        return value, size, depth

    def _sequence(self, node: Any, path: Path) -> tuple[list[Any], int, int]:
        items = [self._value(item, (*path, k)) for k, item in enumerate(node.value)]
        return [value for value, _, _ in items], *_total(items)

    def _mapping(self, node: Any, path: Path) -> tuple[dict[str, Any], int, int]:
        own: dict[str, Any] = {}
        merged: dict[str, Any] = {}
        lines: dict[str, int] = {}
        items = []
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            if key_node.id != 'scalar':
                self._faults.append(
                    Fault(path, f'a list or mapping as a key in line {line}', 'texts as keys')
                )
                continue
            key = str(key_node.value)
            is_merge = key_node.tag == _MERGE
            item = self._value(value_node, path if is_merge else (*path, key))
            items.append(item)
            if is_merge:
                merged = {**self._merged(item[0], path), **merged}
                continue
            if key in lines:
                self._faults.append(
                    Fault(
                        (*path, key),
                        f'two values, in lines {lines[key]} and {line}',
                        'each key once',
                    )
                )
            lines[key] = line
            own[key] = item[0]
        return {**merged, **own}, *_total(items)

    def _merged(self, value: object, path: Path) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for mapping in value if isinstance(value, list) else [value]:
            if isinstance(mapping, dict):
                result = {**mapping, **result}
            else:
                self._faults.append(
                    Fault((*path, '<<'), shown(mapping), 'a mapping, or a list of mappings')
                )
        return result

    def _scalar(self, node: Any, path: Path) -> object:
        if node.tag == 'tag:yaml.org,2002:timestamp' or (
            node.tag.endswith((':int', ':float')) and _SURPRISING_NUMBER.fullmatch(node.value)
        ):
            node.tag = _TEXT
        if node.tag not in _PLAIN:
            return self._untagged(node, path)
        try:
            return within_double(self._loader.construct_object(node))
        except (ValueError, KeyError):
            return self._untagged(node, path)

    def _untagged(self, node: Any, path: Path) -> object:
        value = f'{shown(node.value)} as {node.tag}' if node.id == 'scalar' else node.tag
        self._faults.append(Fault(path, value, 'plain YAML: texts, numbers, lists and mappings'))
        return None


def _total(items: list[tuple[Any, int, int]]) -> tuple[int, int]:
    return 1 + sum(size for _, size, _ in items), 1 + max((d for _, _, d in items), default=0)


def _place(mark: Any) -> str:
    return f'line {mark.line + 1}, column {mark.column + 1}'


def _too_deep(mark: Any) -> Fault:
    return Fault((_place(mark),), 'deeper nesting', f'at most {DEEPEST_NESTING} levels')


def _syntax_fault(error: Any) -> Fault:
    mark = getattr(error, 'problem_mark', None)
    problem = getattr(error, 'problem', None) or getattr(error, 'reason', None) or str(error)
    if mark is None:
        position = getattr(error, 'position', None)
        return Fault((), f'an error at byte {position}: {problem}', 'YAML in UTF-8')
    context = getattr(error, 'context', None)
    return Fault(
        (_place(mark),), f'an error: {problem}' + (f' {context}' if context else ''), 'YAML'
    )
