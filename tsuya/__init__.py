"""What a person runs: the command line, the gallery of pictures, the doctor."""
