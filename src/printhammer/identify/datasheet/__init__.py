"""Build hammer files from manufacturers' data sheets of actuators."""
