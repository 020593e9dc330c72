"""Metrics with one written definition each, tables, and viewing tests. Knows nothing of training."""

from dnnvss.evaluation.metrics import METRICS, centred_rmse, correlation, global_variance_ratio, rmse
from dnnvss.evaluation.report import Report, evaluate, score

__all__ = ["METRICS", "Report", "centred_rmse", "correlation", "evaluate", "global_variance_ratio", "rmse", "score"]
