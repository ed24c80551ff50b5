"""Registers the environments of evalbus with LeRobot, which imports installed packages named lerobot_env_*."""

import evalbus.integrations.lerobot_env  # noqa: F401
