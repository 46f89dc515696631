"""Where the example problems are."""

from __future__ import annotations

from pathlib import Path

PROBLEM_FILES = sorted((Path(__file__).parents[3] / 'config' / 'problems').glob('*.yaml'))
STORY_FILE = next(file for file in PROBLEM_FILES if file.stem == 'trinkle_hunter_1991')
