"""Flight simulator: rendered images, IMU and laser range with exact truth, from a scene file and a seed."""
