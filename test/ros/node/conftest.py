from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from ros.node.harness import STORY_FILE, Client, Planner


@pytest.fixture
def start_planner(tmp_path: Path) -> Iterator[Callable[..., Planner]]:
    """Starts a planner with the hand and object of 1991, which records into tmp_path/runs."""
    running: list[Planner] = []

    def start(**parameters: Any) -> Planner:
        defaults = {
            'hand_file': str(STORY_FILE),
            'object_file': str(STORY_FILE),
            'record_directory': str(tmp_path / 'runs'),
        }
        running.append(Planner(**{**defaults, **parameters}))
        return running[-1]

    yield start
    for planner in running:
        planner.close()


@pytest.fixture
def planner(start_planner: Callable[..., Planner]) -> Planner:
    return start_planner()


@pytest.fixture
def client() -> Iterator[Client]:
    client = Client()
    yield client
    client.close()
