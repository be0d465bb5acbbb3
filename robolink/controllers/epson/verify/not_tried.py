"""What cannot be settled by reading, and why. Nothing here talks to the controller."""

from robolink.controllers.epson.verify.verification import Fact
from robolink.messages import tr


def not_tried() -> tuple[Fact, ...]:
    """Return the facts that would need a motion, a write, an error or a long wait."""
    error = tr("not tried: it would leave the controller in error")
    moving = tr("not tried: something would have to run and be stopped")
    minutes = tr("not tried: it takes minutes")
    setup = tr("cannot be read over the wire: look at the controller's setup")
    monitoring = tr("not tried: no command is sent in that mode")
    disturbing = tr("not tried: it could end this connection")
    writing = tr("not tried: it would change something")
    many = tr("not tried: it takes many readings")
    why_not = (
        (tr("TLSet(n) of an undefined tool"), error, "tlset_of_undefined"),
        (tr("answer to a statement that fails"), error, "execute_failure"),
        (tr("code of that answer"), error, "execute_failure_code"),
        (tr("order of the answers around an Abort"), moving, "abort_reply_first"),
        (tr("a statement whose client vanishes"), moving, "execute_on_disconnect"),
        (tr("Logout while a task runs"), moving, "logout_while_running"),
        (tr("refusal while only monitoring"), monitoring, "monitoring_refusal"),
        (tr("Move ... Till whose input is on already"), moving, "till_already_met"),
        (tr("remote time-out while only monitoring"), minutes, "monitoring_timeout"),
        (tr("a second client"), disturbing, "second_client"),
        (tr("TLClr of the selected tool"), writing, "clear_selected_tool"),
        (tr("XYLim limits the tip or the flange"), writing, "xylim_counts"),
        (
            tr("a failed statement without the error state"),
            error,
            "error_state_after_failed_execute",
        ),
        (tr("Login without a parameter"), disturbing, "login_without_parameter"),
        (tr("a robot's number left out"), writing, "missing_robot_number"),
        (tr("SetCurRobot,0"), writing, "robot_zero"),
        (tr("assignment to a variable"), writing, "variable_assignment"),
        (tr("If ... Then in a statement"), error, "single_line_if"),
        (tr("Accel above 100 percent"), error, "accel_max"),
        (tr("time allowed before the login"), minutes, "login_timeout_s"),
        (tr("remote time-out"), setup, "remote_timeout_s"),
        (tr("noise of the measured position"), many, "real_pos_noise_mm"),
    )
    return tuple(Fact(name, finding, option) for name, finding, option in why_not)
