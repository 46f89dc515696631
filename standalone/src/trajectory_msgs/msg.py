"""Messages of trajectory_msgs, made from their definitions on first use."""

from typing import Any

from ros_standalone.interfaces.packages import member, members

__all__ = members(__name__)


def __getattr__(name: str) -> Any:
    return member(__name__, name)


def __dir__() -> list[str]:
    return members(__name__)
