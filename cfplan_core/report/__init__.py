"""What people look at: tables on a terminal, the paper's figures, animations."""
