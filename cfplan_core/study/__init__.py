"""Studies: plan and execute over a grid or a sample of parameters, on many machines."""
