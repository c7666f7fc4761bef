"""The box: what runs beside a student's code, in a process of its own. It imports numpy and nothing of the course."""
