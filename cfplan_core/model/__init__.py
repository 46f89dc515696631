"""The hand, the object and the problem: frozen data, in SI units, angles counter-clockwise."""

from cfplan_core.model.hand import Finger as Finger
from cfplan_core.model.hand import Hand as Hand
from cfplan_core.model.hand import Joint as Joint
from cfplan_core.model.hand import Link as Link
from cfplan_core.model.problem import Goal as Goal
from cfplan_core.model.problem import Grasp as Grasp
from cfplan_core.model.problem import ManipulatedObject as ManipulatedObject
from cfplan_core.model.problem import Problem as Problem
from cfplan_core.model.problem import Tolerance as Tolerance
