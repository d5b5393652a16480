"""`trace`: contours, simplified optimally, refitted, and told as a construction sequence."""
