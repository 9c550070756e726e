"""What people look at: the Rerun recording and live view, figures, and the pages of reports."""
