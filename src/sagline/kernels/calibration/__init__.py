"""Residuals and derivatives of readings, pose by pose; docs/model.md, section 14."""
