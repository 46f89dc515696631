"""Interface package rmw_dds_common."""
