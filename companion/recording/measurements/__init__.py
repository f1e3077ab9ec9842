"""What a flight is measured and judged by: tracking, steps, dead time, and the verdict."""
