"""Laws of the damping of the armature."""
