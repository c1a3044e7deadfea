"""The predictor: recursive least squares."""
