"""SPEL+ as text: typed statements out, printed values in, and the formatting twins."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.protocols.spel._queries import RobotType as RobotType
    from robolink.protocols.spel._queries import list_tools as list_tools
    from robolink.protocols.spel._queries import parse_robot_type as parse_robot_type
    from robolink.protocols.spel._queries import print_braking as print_braking
    from robolink.protocols.spel._queries import print_here as print_here
    from robolink.protocols.spel._queries import print_joint_angle as print_joint_angle
    from robolink.protocols.spel._queries import print_motor as print_motor
    from robolink.protocols.spel._queries import print_output as print_output
    from robolink.protocols.spel._queries import print_plain_point as print_plain_point
    from robolink.protocols.spel._queries import print_point as print_point
    from robolink.protocols.spel._queries import print_point_defined as print_point_defined
    from robolink.protocols.spel._queries import print_power as print_power
    from robolink.protocols.spel._queries import print_real_position as print_real_position
    from robolink.protocols.spel._queries import print_robot as print_robot
    from robolink.protocols.spel._queries import print_robot_model as print_robot_model
    from robolink.protocols.spel._queries import print_robot_serial as print_robot_serial
    from robolink.protocols.spel._queries import print_robot_type as print_robot_type
    from robolink.protocols.spel._queries import print_selected_tool as print_selected_tool
    from robolink.protocols.spel._queries import print_speed as print_speed
    from robolink.protocols.spel._queries import print_speed_s as print_speed_s
    from robolink.protocols.spel._queries import print_speeding_up as print_speeding_up
    from robolink.protocols.spel._queries import print_tool as print_tool
    from robolink.protocols.spel._queries import print_tool_defined as print_tool_defined
    from robolink.protocols.spel._queries import print_tool_x as print_tool_x
    from robolink.protocols.spel._queries import print_two_texts as print_two_texts
    from robolink.protocols.spel._queries import show_base as show_base
    from robolink.protocols.spel._queries import tilts_tool as tilts_tool
    from robolink.protocols.spel._queries import wait_half_a_second as wait_half_a_second
    from robolink.protocols.spel._queries import where as where
    from robolink.protocols.spel._statements import MAX_STATEMENT as MAX_STATEMENT
    from robolink.protocols.spel._statements import Statement as Statement
    from robolink.protocols.spel._statements import clear_tool as clear_tool
    from robolink.protocols.spel._statements import go as go
    from robolink.protocols.spel._statements import move as move
    from robolink.protocols.spel._statements import power_high as power_high
    from robolink.protocols.spel._statements import power_low as power_low
    from robolink.protocols.spel._statements import print_joint_of as print_joint_of
    from robolink.protocols.spel._statements import print_reachable as print_reachable
    from robolink.protocols.spel._statements import select_tool as select_tool
    from robolink.protocols.spel._statements import set_tool as set_tool
    from robolink.protocols.spel._statements import speed as speed
    from robolink.protocols.spel._statements import speed_s as speed_s
    from robolink.protocols.spel._until import move_find as move_find
    from robolink.protocols.spel._until import move_till as move_till
    from robolink.protocols.spel._until import print_found_position as print_found_position
    from robolink.protocols.spel._until import print_input as print_input
    from robolink.protocols.spel._until import print_position_found as print_position_found
    from robolink.protocols.spel._until import print_till_on as print_till_on
    from robolink.protocols.spel._values import Layout as Layout
    from robolink.protocols.spel._values import PrintedPoint as PrintedPoint
    from robolink.protocols.spel._values import decimal as decimal
    from robolink.protocols.spel._values import format_point as format_point
    from robolink.protocols.spel._values import format_tool_listing as format_tool_listing
    from robolink.protocols.spel._values import parse_boolean as parse_boolean
    from robolink.protocols.spel._values import parse_integer as parse_integer
    from robolink.protocols.spel._values import parse_number as parse_number
    from robolink.protocols.spel._values import parse_point as parse_point
    from robolink.protocols.spel._values import parse_tool_listing as parse_tool_listing
    from robolink.protocols.spel._values import posture_marks as posture_marks
    from robolink.protocols.spel._where import PrintedWhere as PrintedWhere
    from robolink.protocols.spel._where import format_where as format_where
    from robolink.protocols.spel._where import parse_base as parse_base
    from robolink.protocols.spel._where import parse_where as parse_where
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_queries": (
                "RobotType list_tools parse_robot_type print_braking print_here print_joint_angle "
                "print_motor print_output "
                "print_point print_point_defined print_power print_real_position "
                "print_robot print_robot_model print_robot_serial print_robot_type "
                "print_selected_tool print_speed print_speed_s print_speeding_up print_tool "
                "print_plain_point print_tool_defined print_tool_x print_two_texts "
                "show_base tilts_tool wait_half_a_second where"
            ),
            "_statements": (
                "MAX_STATEMENT Statement clear_tool go move power_high power_low "
                "print_joint_of print_reachable select_tool set_tool speed speed_s"
            ),
            "_until": (
                "move_find move_till print_found_position print_input "
                "print_position_found print_till_on"
            ),
            "_values": (
                "Layout PrintedPoint decimal format_point format_tool_listing parse_boolean "
                "parse_integer parse_number parse_point parse_tool_listing posture_marks"
            ),
            "_where": "PrintedWhere format_where parse_base parse_where",
        },
    )
