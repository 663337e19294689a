"""Model of the hammer: force laws, total force, modes of motion, coil circuit, and value of the drive."""
