"""What my_terrain.py is made of besides the student's functions: a frame, and a stage for each lesson."""
