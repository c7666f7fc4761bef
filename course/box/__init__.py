"""The box: code that runs in the separate process of a student's code. It imports numpy and nothing of the course."""
