"""What our objects and their parts weigh beside published weights."""
