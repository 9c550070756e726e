"""One fit that our identification and `mujoco.sysid` can both do: the armatures of an arm."""
