"""Monte-Carlo studies: the paper's figures as trials that can be repeated one by one."""
