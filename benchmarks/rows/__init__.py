"""The rows, in the order of the page: modules with TITLE, measure() and a docstring that says what is compared."""

ROWS = (
    "generation",
    "actor_training",
    "vertex_loss",
    "marionet_training",
    "kinematics",
    "judging",
    "preparing",
    "training_input",
    "command_line",
    "lengths",
    "data_size",
    "long_motion",
    "evaluation_set",
    "profiles",
)
