"""The course: twelve lessons on level of detail, with exercises that check themselves."""
