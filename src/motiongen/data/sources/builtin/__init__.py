"""A procedural motion corpus: key poses, phase curves and footstep plans, solved by leg inverse kinematics."""
