"""The walk page beside what people do otherwise: what each shows when, and in how much memory."""
