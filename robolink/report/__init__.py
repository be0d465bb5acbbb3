"""The report of a tool change: one HTML page that needs nothing beside itself."""

from robolink.report._file import save as save
from robolink.report._page import render as render
from robolink.report._values import Outcome as Outcome
from robolink.report._values import Report as Report
