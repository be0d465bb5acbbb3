"""Executes a procedure on a motion group, with a person at the reference point.

The runner owns what a procedure must not know: limits, deadlines, the clock, and the watch
over the controller while a person is asked. Remote control cuts an idle client off after the
remote time-out (60 s by default, docs/reference/epson.md 1.1), and a person may take half an hour;
so the prompt is polled, and the status is read between polls. That also shows an emergency stop or
an open guard at once.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.runner._dry_run import ArmAhead as ArmAhead
    from robolink.runner._dry_run import ForeseenStep as ForeseenStep
    from robolink.runner._dry_run import considered as considered
    from robolink.runner._dry_run import first_clear as first_clear
    from robolink.runner._dry_run import foreseen_steps as foreseen_steps
    from robolink.runner._dry_run import nothing_in_the_way as nothing_in_the_way
    from robolink.runner._jog_steps import RunSettings as RunSettings
    from robolink.runner._jog_steps import jog_target as jog_target
    from robolink.runner._jog_steps import parse_decimal as parse_decimal
    from robolink.runner._jog_steps import parse_steps as parse_steps
    from robolink.runner._jog_steps import refuse_decimal_comma as refuse_decimal_comma
    from robolink.runner._jog_steps import way_in_words as way_in_words
    from robolink.runner._place_question import AGAIN as AGAIN
    from robolink.runner._place_question import MOST_REFUSED as MOST_REFUSED
    from robolink.runner._place_question import TakenAgainError as TakenAgainError
    from robolink.runner._place_question import inputs_of as inputs_of
    from robolink.runner._prompt_context import POLL_S as POLL_S
    from robolink.runner._prompt_context import AngleShown as AngleShown
    from robolink.runner._prompt_context import ChoiceRow as ChoiceRow
    from robolink.runner._prompt_context import FitRow as FitRow
    from robolink.runner._prompt_context import FitSubject as FitSubject
    from robolink.runner._prompt_context import GuidedOperator as GuidedOperator
    from robolink.runner._prompt_context import JogRange as JogRange
    from robolink.runner._prompt_context import JogSubject as JogSubject
    from robolink.runner._prompt_context import MoveSubject as MoveSubject
    from robolink.runner._prompt_context import OfferedChoice as OfferedChoice
    from robolink.runner._prompt_context import Operator as Operator
    from robolink.runner._prompt_context import Question as Question
    from robolink.runner._prompt_context import TouchSubject as TouchSubject
    from robolink.runner._prompt_context import awaited_line as awaited_line
    from robolink.runner._prompt_context import regard as regard
    from robolink.runner._runner import EndingWatch as EndingWatch
    from robolink.runner._runner import Runner as Runner
    from robolink.runner._runner import ask_for_pose as ask_for_pose
    from robolink.runner._steps import FINEST_STEP as FINEST_STEP
    from robolink.runner._steps import SETTLING_S as SETTLING_S
    from robolink.runner._steps import Ask as Ask
    from robolink.runner._steps import Confirm as Confirm
    from robolink.runner._steps import Consider as Consider
    from robolink.runner._steps import Look as Look
    from robolink.runner._steps import Move as Move
    from robolink.runner._steps import Notify as Notify
    from robolink.runner._steps import NotYet as NotYet
    from robolink.runner._steps import Procedure as Procedure
    from robolink.runner._steps import Seek as Seek
    from robolink.runner._steps import SeenAt as SeenAt
    from robolink.runner._steps import Step as Step
    from robolink.runner._steps import StepDone as StepDone
    from robolink.runner._steps import TakenStep as TakenStep
    from robolink.runner._steps import TeachPrompt as TeachPrompt
    from robolink.runner._steps import TouchedAt as TouchedAt
    from robolink.runner._yes_no import BACK as BACK
    from robolink.runner._yes_no import MORE as MORE
    from robolink.runner._yes_no import ask_yes_no as ask_yes_no
    from robolink.runner._yes_no import ask_yes_no_or as ask_yes_no_or
    from robolink.runner._yes_no import yes_or_no as yes_or_no
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_dry_run": (
                "ArmAhead ForeseenStep considered first_clear foreseen_steps nothing_in_the_way"
            ),
            "_jog_steps": (
                "RunSettings jog_target parse_decimal parse_steps refuse_decimal_comma way_in_words"
            ),
            "_place_question": "AGAIN MOST_REFUSED TakenAgainError inputs_of",
            "_prompt_context": (
                "AngleShown ChoiceRow FitRow FitSubject GuidedOperator JogRange "
                "JogSubject MoveSubject OfferedChoice Operator POLL_S Question "
                "TouchSubject awaited_line regard"
            ),
            "_runner": "EndingWatch Runner ask_for_pose",
            "_steps": (
                "Ask Confirm Consider FINEST_STEP Look Move NotYet Notify Procedure "
                "SETTLING_S Seek SeenAt Step StepDone TakenStep TeachPrompt TouchedAt"
            ),
            "_yes_no": "BACK MORE ask_yes_no ask_yes_no_or yes_or_no",
        },
    )
