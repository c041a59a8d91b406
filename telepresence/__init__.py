"""What the robots share: pictures, streams, safety, simulation. Importing it imports nothing else."""
