"""Interface package std_srvs."""
