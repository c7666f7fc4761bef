"""The course: thirteen lessons on level of detail, with exercises that check themselves."""
