"""Problems and plans as the commands read them, with everything that is wrong with them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cfplan_core.errors import CfplanError, Finding, InvalidProblemError
from cfplan_core.model import Problem
from cfplan_core.trajectory.plan_result import PlanResult

PROBLEM_FOLDER = Path('config') / 'problems'


@dataclass(frozen=True)
class Examined:
    """A problem file after every check, of its format and of its grasps.

    Attributes:
        problem: The problem if it could be built, even one with findings.
        findings: Everything that is wrong.
    """

    problem: Problem | None
    findings: tuple[Finding, ...]

    def valid_problem(self) -> Problem:
        """Return the problem.

        Raises:
            InvalidProblemError: There are findings; it carries them all.
        """
        if self.problem is None or self.findings:
            raise InvalidProblemError(self.findings)
        return self.problem


def examine(path: Path) -> Examined:
    """Read a problem file and check its start and goal grasp."""
    from cfplan_core.model.loading import read_problem
    from cfplan_core.planning.grasp_check import check_problem

    reading = read_problem(path)
    findings = tuple(reading.findings)
    if reading.problem is not None:
        fields = {finding.field for finding in findings}
        further = check_problem(reading.problem, str(path))
        findings += tuple(finding for finding in further if finding.field not in fields)
    return Examined(reading.problem, findings)


def problem_of_plan(result: PlanResult, plan_path: Path, given: Path | None) -> Problem:
    """Find and read the problem that a plan belongs to.

    Args:
        result: The plan.
        plan_path: Its file, beside which the problem may be.
        given: The problem's file if the user named it.

    Raises:
        CfplanError: No file is found, or the file is of another problem.
        InvalidProblemError: The file breaks the format.
    """
    from cfplan_core.model.loading import load_problem

    path = given if given is not None else _find(result.problem, plan_path)
    problem = load_problem(path)
    if problem.name != result.problem or problem.hand.joint_names != result.joint_names:
        raise CfplanError(
            f'{plan_path}: is a plan for {result.problem!r} with joints '
            f'{", ".join(result.joint_names)}, but {path} is {problem.name!r} with joints '
            f'{", ".join(problem.hand.joint_names)}'
        )
    return problem


def _find(name: str, plan_path: Path) -> Path:
    """Look for NAME.yaml beside the plan and among the example problems."""
    folders = [plan_path.parent, PROBLEM_FOLDER, *_installed_problem_folders()]
    if name == Path(name).name:
        for folder in folders:
            if (folder / f'{name}.yaml').is_file():
                return folder / f'{name}.yaml'
    raise CfplanError(
        f'{plan_path}: no {name}.yaml beside the plan, in {PROBLEM_FOLDER} or in the '
        'installation; name the problem with --problem FILE'
    )


def _installed_problem_folders() -> list[Path]:
    """Where the example problems are: in the source tree, or below an installation's prefix."""
    module = Path(__file__).resolve()
    source_tree = module.parents[2]
    return [
        source_tree / PROBLEM_FOLDER,
        *(prefix / 'share' / 'cfplan_ros' / PROBLEM_FOLDER for prefix in module.parents),
    ]
