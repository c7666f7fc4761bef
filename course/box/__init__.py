"""The box: code that runs in the process of a student's code. It imports nothing of the course outside this folder."""
