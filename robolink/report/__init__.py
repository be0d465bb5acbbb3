"""The report of a tool change: one HTML page that needs nothing beside itself."""

from robolink.report._drift_page import render_drift as render_drift
from robolink.report._drift_page import save_drift as save_drift
from robolink.report._file import save as save
from robolink.report._page import render as render
from robolink.report._recorded import reports_of as reports_of
from robolink.report._recorded_fit import recorded_fit as recorded_fit
from robolink.report._values import Attempt as Attempt
from robolink.report._values import GaugeOnRecord as GaugeOnRecord
from robolink.report._values import Judgement as Judgement
from robolink.report._values import Outcome as Outcome
from robolink.report._values import Record as Record
from robolink.report._values import Report as Report
from robolink.report._values import TouchOnRecord as TouchOnRecord
from robolink.report.pictures.control_chart import chart_title as chart_title
