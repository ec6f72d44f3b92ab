"""The checks: functions of a subject that return None, raise a `Violation`, or raise why they do not apply."""
