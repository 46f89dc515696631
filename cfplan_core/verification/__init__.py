"""Certify a plan frame by frame without the planner's code: shapely distances, HiGHS programs."""

from cfplan_core.verification.report import Check as Check
from cfplan_core.verification.report import Failure as Failure
from cfplan_core.verification.report import VerificationReport as VerificationReport
from cfplan_core.verification.verify import verify_plan as verify_plan
