"""Which way a tool turns so that the joint stays inside its range."""


def toward_zero(u_deg: float, turn_deg: float) -> float:
    """Return U after a turn that keeps it inside the joint's range: toward zero."""
    return u_deg - turn_deg if u_deg > 0 else u_deg + turn_deg
