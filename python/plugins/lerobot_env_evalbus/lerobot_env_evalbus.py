"""Registers the environments of evalbus with LeRobot, which imports installed packages named lerobot_env_*."""

import evalbus.lerobot.env  # noqa: F401
