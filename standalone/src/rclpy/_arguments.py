"""ROS's part of a command line: what stands between `--ros-args` and `--`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rclpy import _log_output
from rclpy._name_rules import namespace_violation
from rclpy._parameter_files import ParameterRule, parse_value, read_parameter_file
from rclpy._remapping import RemapRule, parse_remap_rule
from rclpy.exceptions import RCLInvalidROSArgsError, UnknownROSArgsError
from rclpy.impl.logging_severity import LoggingSeverity

ROS_ARGS = '--ros-args'
END = '--'


@dataclass(frozen=True)
class Arguments:
    """What a command line says to ROS.

    Attributes:
        remappings: Remapping rules in their order.
        parameters: Parameter values by node pattern, in their order; later ones win.
        log_level: The level of loggers that have none of their own, None where not given.
        logger_levels: Levels by logger name.
        stdout_logs: Whether log messages go to the console.
        rosout_logs: Whether they go to /rosout.
        external_lib_logs: Whether they would go to log files, which this runtime does not write.
        enclave: The security enclave's name.
        unparsed: The arguments that are not ROS's.
    """

    remappings: tuple[RemapRule, ...] = ()
    parameters: tuple[ParameterRule, ...] = ()
    log_level: LoggingSeverity | None = None
    logger_levels: Mapping[str, LoggingSeverity] = field(default_factory=dict)
    stdout_logs: bool = True
    rosout_logs: bool = True
    external_lib_logs: bool = True
    enclave: str = '/'
    unparsed: tuple[str, ...] = ()

    def parameter_overrides(self, node: str) -> dict[str, Any]:
        """Parameter values for the node of this full name, by parameter name."""
        return parameter_overrides(self.parameters, node)


def parameter_overrides(rules: Iterable[ParameterRule], node: str) -> dict[str, Any]:
    """The values that rules give the node of this full name; later rules win."""
    values: dict[str, Any] = {}
    for rule in rules:
        if rule.matches(node):
            values.update(rule.values)
    return values


def parse(args: Sequence[str] | None = None) -> Arguments:
    """Read a command line; None stands for the process's own.

    Raises:
        RCLInvalidROSArgsError: If a ROS argument is malformed, with the reason.
        UnknownROSArgsError: If there are arguments after --ros-args that ROS does not know.
    """
    parser = _Parser()
    parser.read(list(sys.argv if args is None else args))
    if parser.unknown:
        raise UnknownROSArgsError(parser.unknown)
    return Arguments(
        remappings=tuple(parser.remappings),
        parameters=tuple(parser.parameters),
        log_level=parser.log_level,
        logger_levels=parser.logger_levels,
        stdout_logs=parser.outputs['stdout'],
        rosout_logs=parser.outputs['rosout'],
        external_lib_logs=parser.outputs['external-lib'],
        enclave=parser.enclave,
        unparsed=tuple(parser.unparsed),
    )


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """The arguments that are not ROS's, in their order; None stands for the process's own."""
    return list(_split(list(sys.argv if args is None else args))[0])


def _split(args: list[str]) -> tuple[list[str], list[str]]:
    """Separate other arguments from ROS's, without the markers."""
    others: list[str] = []
    ros: list[str] = []
    in_ros_args = False
    for argument in args:
        if argument == ROS_ARGS:
            in_ros_args = True
        elif in_ros_args and argument == END:
            in_ros_args = False
        else:
            (ros if in_ros_args else others).append(argument)
    return others, ros


class _Parser:
    def __init__(self) -> None:
        self.remappings: list[RemapRule] = []
        self.parameters: list[ParameterRule] = []
        self.log_level: LoggingSeverity | None = None
        self.logger_levels: dict[str, LoggingSeverity] = {}
        self.outputs = {'stdout': True, 'rosout': True, 'external-lib': True}
        self.enclave = '/'
        self.unparsed: list[str] = []
        self.unknown: list[str] = []
        # By flag: what rcl calls its value in a complaint, what it says when the value is
        # missing, and who reads it.
        remap = ('remap rule', 'No remap rule found.', self._remap)
        parameter = ('parameter override rule', 'No parameter override rule found.', self._set)
        enclave = ('enclave name', 'No enclave path provided.', self._set_enclave)
        self._flags: dict[str, tuple[str, str, Callable[[str], None]]] = {
            '-r': remap,
            '--remap': remap,
            '-p': parameter,
            '--param': parameter,
            '--params-file': ('params file', 'No file path provided.', self._read_file),
            '--log-level': ('log level', 'No log level provided.', self._set_level),
            '-e': enclave,
            '--enclave': enclave,
            '--log-config-file': (
                'log configuration file',
                'No file path provided.',
                self._no_log_files,
            ),
            '--log-file-name': ('log file name prefix', 'No name provided.', self._no_log_files),
        }

    def read(self, args: list[str]) -> None:
        self.unparsed, ros = _split(args)
        remaining = iter(ros)
        for flag in remaining:
            if flag in self._flags:
                self._read_flag(flag, next(remaining, None))
            elif not self._switch(flag):
                self.unknown.append(flag)

    def _read_flag(self, flag: str, value: str | None) -> None:
        what, missing, reader = self._flags[flag]
        if value is None:
            raise _invalid(f"Couldn't parse trailing {flag} flag. {missing}")
        try:
            reader(value)
        except ValueError as error:
            raise _invalid(f"Couldn't parse {what}: '{flag} {value}'. Error: {error}") from None

    def _switch(self, flag: str) -> bool:
        for output in self.outputs:
            if flag in (f'--enable-{output}-logs', f'--disable-{output}-logs'):
                self.outputs[output] = flag.startswith('--enable')
                return True
        return False

    def _remap(self, value: str) -> None:
        self.remappings.append(parse_remap_rule(value))

    def _set(self, value: str) -> None:
        left, separator, text = value.partition(':=')
        if not separator:
            raise ValueError(f"expected 'name:=value', got '{value}' without ':='")
        node, colon, name = left.rpartition(':')
        if not name or (colon and not node):
            raise ValueError(f"expected a parameter's name before ':=', got '{value}'")
        pattern = f'/**/{node.lstrip("/")}' if colon else '/**'
        self.parameters.append(ParameterRule(pattern, {name: parse_value(text)}))

    def _read_file(self, value: str) -> None:
        self.parameters.extend(read_parameter_file(value))

    def _set_level(self, value: str) -> None:
        logger, separator, level_name = value.rpartition(':=')
        if separator and not logger:
            raise ValueError(f"expected 'logger:=level', got '{value}' without a logger")
        try:
            level = LoggingSeverity[level_name.upper()]
        except KeyError:
            names = ', '.join(severity.name.lower() for severity in LoggingSeverity)
            raise ValueError(f"expected one of {names}, got '{level_name}'") from None
        if separator:
            self.logger_levels[logger] = level
        else:
            self.log_level = level

    def _set_enclave(self, value: str) -> None:
        violation = namespace_violation(value)
        if violation is not None:
            raise ValueError(violation[0].replace('namespace', 'enclave name', 1))
        self.enclave = value

    def _no_log_files(self, value: str) -> None:
        raise ValueError('the standalone rclpy writes no log files; it logs to stderr and /rosout')


def _invalid(reason: str) -> RCLInvalidROSArgsError:
    return RCLInvalidROSArgsError(f'Failed to parse global arguments: {reason}')


def apply_log_levels(arguments: Arguments) -> None:
    """Give the loggers the levels of a command line, and switch the console as it says."""
    if arguments.log_level is not None:
        _log_output.set_level('', arguments.log_level)
    for name, level in arguments.logger_levels.items():
        _log_output.set_level(name, level)
    _log_output.enable_console(arguments.stdout_logs)
