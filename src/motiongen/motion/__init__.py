"""Poses, rotations, skeletons, kinematics, canonical frames and body models. Pure functions on tensors."""
