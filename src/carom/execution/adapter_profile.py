"""Loads and checks the adapter of an engine, and returns capabilities and settings of a profile."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Adapter, Capabilities, unsupported_reason
from carom.engines.registry import explain_unavailable_adapter, load_adapter, require_profile
from carom.errors import AdapterError
from carom.execution.exception_text import describe_exception
from carom.execution.job import Job, SettingOverrides, UnavailableError, UnsupportedError
from carom.execution.validate_adapter import build_adapter_error, to_plain_settings
from carom.model.trace import Setting


def load_supported_adapter(job: Job) -> Adapter:
    """Load the adapter of a job, and check that its engine is installed and supports the scene.

    Raises:
        UnavailableError: The adapter can't be loaded, or its engine is not installed.
        UnsupportedError: The adapter's capabilities exclude the scene.
    """
    try:
        adapter = load_adapter(job.engine)
    except AdapterError as error:
        raise UnavailableError(str(error)) from error
    if reason := explain_unavailable_adapter(adapter):
        raise UnavailableError(reason)
    located = job.profile in adapter.profiles and adapter.profiles[job.profile].located
    # The capabilities that a profile declares are valid only if no setting of the profile is replaced.
    able = adapter.capabilities if job.method.overrides else capabilities_of(adapter, job.profile)
    if reason := unsupported_reason(job.scene, able, job.dt_s, located=located):
        raise UnsupportedError(reason)
    return adapter


def capabilities_of(adapter: Adapter, profile: str) -> Capabilities:
    """Return the capabilities of a profile. If the profile declares none, return the adapter's."""
    known = adapter.profiles.get(profile)
    return known.capabilities if known is not None and known.capabilities is not None else adapter.capabilities


def prepare_settings(
    adapter: Adapter, profile: str, dt_s: float, overrides: SettingOverrides = ()
) -> Mapping[str, Setting]:
    """Return the settings of a profile for a step size. Settings in `overrides` replace the profile's settings.

    Raises:
        UnknownNameError: The adapter has no such profile.
        AdapterError: The profile raises an exception, or a setting is not a plain value.
    """
    require_profile(adapter.name, profile, adapter.profiles)
    try:
        settings = dict(adapter.profiles[profile].settings(dt_s))
    except Exception as error:
        raise AdapterError(f"profile {profile!r} of {adapter.name} fails: {describe_exception(error)}") from error
    plain = to_plain_settings(settings, f"of profile {profile!r} of {adapter.name}")
    if plain.get("dt_s") != dt_s:
        mistake = f"profile {profile!r} of {adapter.name} must set dt_s to the step size, {dt_s:g}"
        raise build_adapter_error(f"{mistake}, got {plain.get('dt_s', 'none')}")
    return {**plain, **dict(overrides)}
