"""LeRobot: environments (env), data sets (dataset) and checkpoints (policy). docs/lerobot.md."""
